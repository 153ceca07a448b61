"""The toy datasets of `tests/datasets`, for the commands that work on datasets."""

from ..datasets.conftest import paired_dataset, record_toy, toy_rig, toy_settings

__all__ = ["paired_dataset", "record_toy", "toy_rig", "toy_settings"]
