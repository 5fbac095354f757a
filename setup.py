"""Installs hma_gripper_sim, by pip or as an ament_python package by colcon."""

from __future__ import annotations

import os

from setuptools import find_packages, setup

PACKAGE_NAME = "hma_gripper_sim"

# `hma_gripper benchmark` is documented for installed packages, so the benchmarks are installed,
# too: as a package of their own, which nothing but that command imports.
BENCHMARKS = "hma_gripper_benchmarks"

# The ROS 2 Jazzy wheels, Linux x86-64, CPython 3.10 to 3.13: one set that works together, so every
# member is pinned (a newer ros-*-msgs alone breaks it, and a bare ros-rclpy is a later ROS 2).
JAZZY_WHEELS = {
    "0.1.0": "rosidl-dynamic-typesupport-fastrtps",
    "0.1.2": "rosidl-dynamic-typesupport wheels-bootstrapper",
    "0.2.0": "rosidl-core-runtime",
    "0.4.2": "rpyutils",
    "0.17.3": "ament-cmake-cppcheck ament-cmake-cpplint ament-cmake-flake8 ament-cmake-pep257"
    " ament-cmake-uncrustify",
    "0.22.2": "rosidl-generator-py",
    "1.3.1": "foonathan-memory-vendor",
    "1.6.0": "rosidl-default-runtime",
    "1.6.1": "spdlog-vendor",
    "1.6.3": "libyaml-vendor",
    "1.8.1": "ament-index-cpp ament-index-python",
    "2.0.3": "action-msgs builtin-interfaces lifecycle-msgs rcl-interfaces rosgraph-msgs"
    " service-msgs type-description-interfaces",
    "2.2.5": "fastcdr",
    "2.5.0": "unique-identifier-msgs",
    "2.11.2": "rcpputils",
    "2.14.5": "fastrtps",
    "2.15.6": "rmw-implementation",
    "3.1.0": "rmw-dds-common",
    "3.1.1": "rcl-logging-interface rcl-logging-spdlog",
    "3.2.2": "rosidl-typesupport-c rosidl-typesupport-cpp",
    "3.6.2": "fastrtps-cmake-module rosidl-typesupport-fastrtps-c rosidl-typesupport-fastrtps-cpp",
    "4.6.6": "rosidl-adapter rosidl-cli rosidl-cmake rosidl-generator-c rosidl-generator-cpp"
    " rosidl-generator-type-description rosidl-parser rosidl-pycommon rosidl-runtime-c"
    " rosidl-runtime-cpp rosidl-typesupport-interface rosidl-typesupport-introspection-c"
    " rosidl-typesupport-introspection-cpp",
    "5.3.6": "actionlib-msgs common-interfaces diagnostic-msgs geometry-msgs nav-msgs sensor-msgs"
    " shape-msgs std-msgs std-srvs stereo-msgs trajectory-msgs visualization-msgs",
    "6.7.4": "rcutils",
    "7.1.6": "rclpy",
    "7.3.2": "rmw rmw-implementation-cmake",
    "8.2.4": "tracetools",
    "8.4.3": "rmw-fastrtps-cpp rmw-fastrtps-shared-cpp",
    "9.2.8": "rcl rcl-action rcl-lifecycle rcl-yaml-param-parser",
}


def shared_files(folder: str) -> list[tuple[str, list[str]]]:
    """All files below `folder`, as data_files entries that keep its layout in share/."""
    return [
        (f"share/{PACKAGE_NAME}/{directory}", [f"{directory}/{name}" for name in sorted(names)])
        for directory, _, names in os.walk(folder)
        if names and not directory.endswith("__pycache__")
    ]


setup(
    name="hma_gripper_sim",
    version="0.1.0",
    description="Fast and accurate simulation of a passive compliant hot-melt-adhesive gripper",
    author="hma_gripper_sim contributors",
    maintainer="hma_gripper_sim contributors",
    maintainer_email="hma-gripper-sim@example.org",
    license="MIT",
    keywords=["ROS", "robotics", "soft gripper", "simulation"],
    classifiers=[
        "Intended Audience :: Science/Research",
        "Operating System :: POSIX :: Linux",
        "Programming Language :: Python :: 3",
        "Topic :: Scientific/Engineering :: Physics",
        "Typing :: Typed",
    ],
    python_requires=">=3.10",
    packages=find_packages(
        include=[PACKAGE_NAME, f"{PACKAGE_NAME}.*", BENCHMARKS, f"{BENCHMARKS}.*"]
    ),
    package_data={PACKAGE_NAME: ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{PACKAGE_NAME}"]),
        (f"share/{PACKAGE_NAME}", ["package.xml"]),
        *shared_files("config"),
        *shared_files("launch"),
    ],
    zip_safe=False,
    install_requires=[
        "click>=8.1",
        "lz4>=4.0",
        "matplotlib>=3.6",
        "mcap>=1.2.1",
        "mcap-ros2-support>=0.5",
        "numba>=0.60",
        "numpy>=1.26",
        "pint>=0.24.4",
        "platformdirs>=3.0",
        "PyYAML>=6.0",
        "rich>=13.0",
        "rosbags>=0.11",
        "scipy>=1.11",
        "zstandard>=0.22",
    ],
    extras_require={
        "bench": ["exudyn>=1.13", "mujoco>=4.0"],
        "docs": ["furo>=2025.9", "sphinx>=8.1,<9"],
        "ros": [
            f"ros-{name}=={version}"
            for version, names in JAZZY_WHEELS.items()
            for name in names.split()
        ],
        # For signal maps that follow a robot's joints.
        "urdf": ["yourdfpy>=0.0.56"],
        # The linters are exact, so that a new release of theirs cannot fail an old commit.
        "test": [
            "hypothesis>=6.100,<7",
            "import-linter==2.17",
            "mypy==2.4.1",
            "pytest>=7.4,<9",
            "pytest-xdist>=3.5,<4",
            "ruff==0.17.6",
            "types-PyYAML>=6.0",
            "xacro>=2.0",
            "yourdfpy>=0.0.56",
        ],
    },
    entry_points={
        "console_scripts": [
            "hma_gripper = hma_gripper_sim.cli.main:main",
            "sim_node = hma_gripper_sim.ros.sim_node:main",
        ],
    },
)
