"""The toy datasets of `tests/datasets`, for the commands that work on datasets."""

from ..datasets.conftest import arm_dataset, paired_dataset, record_toy, toy_rig, toy_settings

__all__ = ["arm_dataset", "paired_dataset", "record_toy", "toy_rig", "toy_settings"]
