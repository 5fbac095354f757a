"""Where the files that come with the package are."""

from __future__ import annotations

from pathlib import Path


def config_directory() -> Path:
    """The shipped ``config`` directory: of a checkout, a wheel or a colcon workspace.

    Raises
    ------
    FileNotFoundError
        The package was installed without its data files.
    """
    package = Path(__file__).resolve().parent
    if (package.parent / "package.xml").is_file():
        return package.parent / "config"
    for parent in package.parents:
        candidate = parent / "share" / package.name / "config"
        if candidate.is_dir():
            return candidate
    raise FileNotFoundError(f"no share/{package.name}/config above {package}: reinstall it")
