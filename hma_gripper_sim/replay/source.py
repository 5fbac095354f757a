"""What is to be replayed, read before the solver is loaded, so that errors come at once."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from hma_gripper_sim.errors import InputError
from hma_gripper_sim.experiments.experiment import Experiment
from hma_gripper_sim.experiments.experiment_file import is_experiment, read_experiment
from hma_gripper_sim.recordings.reading import read_recording
from hma_gripper_sim.recordings.recording import Recording
from hma_gripper_sim.recordings.signal_map import SignalMap


def read_source(
    source: Path, signal_map: Path | None
) -> tuple[Experiment | None, Recording | None]:
    """Return the experiment, if the source is one, and the recording, if there is one.

    Parameters
    ----------
    source
        A log, an experiment's file, or the name of a shipped one.
    signal_map
        File that says where the signals of the log are.

    Raises
    ------
    InputError
        Something given cannot be read.
    """
    with Console(stderr=True).status("reading"):
        if is_experiment(source):
            if signal_map is not None:
                raise InputError("an experiment file names its own", field="--signals")
            experiment = read_experiment(source)
            return experiment, experiment.log.recording if experiment.log else None
        entries = None if signal_map is None else SignalMap.from_yaml(signal_map)
        return None, read_recording(source, entries)
