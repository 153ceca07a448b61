"""The datasets of `tests/datasets`, for the commands that work on them."""

from ..datasets.conftest import changing_datasets, paired_dataset, spot_out_of_reach

__all__ = ["changing_datasets", "paired_dataset", "spot_out_of_reach"]
