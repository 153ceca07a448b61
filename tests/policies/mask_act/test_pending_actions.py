import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from lerobot.policies.act.modeling_act import ACTTemporalEnsembler

from lerobot_excav.errors import ConfigurationError
from lerobot_excav.policies.mask_act.pending_actions import ActionQueue, TemporalEnsembles


def test_an_empty_queue_says_so():
    with pytest.raises(ConfigurationError, match="empty"):
        ActionQueue(4).pop()


@settings(max_examples=50, deadline=None)
@given(
    n_action_steps=st.integers(1, 4),
    changes=st.lists(st.lists(st.booleans(), min_size=3, max_size=3), min_size=1, max_size=12),
)
def test_queue_equals_one_list_per_environment(n_action_steps, changes):
    queue, lists = ActionQueue(n_action_steps), [[], [], []]
    for step, change in enumerate(changes):
        changed = torch.tensor(change) if step else torch.ones(3, dtype=torch.bool)
        stale = queue.stale(changed)
        # The plan made at this step for environment e is 100 step + 10 e + position in the plan.
        plans = 100 * step + 10 * torch.arange(3)[:, None] + torch.arange(4)
        for e in range(3):
            if changed[e] or not lists[e]:
                lists[e] = plans[e, :n_action_steps].tolist()
        if stale.any():
            queue.put(stale, plans[stale][..., None].float())
        assert queue.pop()[:, 0].tolist() == [lists[e].pop(0) for e in range(3)]


@pytest.mark.parametrize("coefficient", [0.0, 0.01, -0.1])
def test_every_environment_has_the_ensemble_of_lerobot_since_its_last_change(coefficient):
    ours, steady, late = TemporalEnsembles(coefficient, 6), *(ACTTemporalEnsembler(coefficient, 6) for _ in range(2))
    for step, chunk in enumerate(torch.randn(8, 3, 6, 2, generator=torch.Generator().manual_seed(0))):
        action = ours.update(chunk, torch.tensor([step == 0, step in (0, 5), step == 0]))
        expected = steady.update(chunk).clone()
        if step >= 5:
            expected[1] = late.update(chunk)[1]
        torch.testing.assert_close(action, expected)
