"""What a row shows a policy in place of its correct mask: flags of `lerobot-eval`, by the name of the row."""

CONDITIONS = {name: f"--env.mask_condition={name}" for name in ("zero", "random", "mismatched")}
DROPOUTS = {f"dropout_{percent}": f"--env.mask_dropout={percent / 100}" for percent in (20, 50)}
# As before the policy held the last mask while the next ones are empty.
UNHELD = {f"unheld_{row}": f"{flags} --policy.hold_mask_frames=0" for row, flags in DROPOUTS.items()}


def noises(sizes_px):
    """Return the rows of imprecise masks, from the sizes [px] of every kind of noise."""
    return {
        f"{noise}_{px}px": f"--env.mask_noise={noise} --env.mask_noise_px={px}"
        for noise, sizes in sizes_px.items()
        for px in sizes
    }
