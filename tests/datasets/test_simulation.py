import subprocess
import sys


def test_workers_load_neither_lerobot_nor_torch():
    # Nothing on the way to a job in a worker may import them: it cost 10 s and 1 GB per process.
    code = (
        "import sys\n"
        "from lerobot_excav.datasets.simulation import simulate_episode\n"
        "from lerobot_excav.datasets.workers import worker_pool\n"
        "from lerobot_excav.evaluation.operator_run import play_for_metrics\n"
        "from lerobot_excav.envs.excavator.env import ExcavatorEnv\n"
        "print([name for name in ('lerobot', 'torch') if name in sys.modules])"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"
