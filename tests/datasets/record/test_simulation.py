import subprocess
import sys


def test_workers_load_neither_lerobot_nor_torch():
    # Nothing on the way to a job in a worker may import them: it cost 10 s and 1 GB per process.
    code = (
        "import sys\n"
        "from lerobot_excav.datasets.record.simulation import simulate_episode\n"
        "from lerobot_excav.datasets.record.workers import worker_pool\n"
        "from lerobot_excav.evaluation.operator_run import play_for_metrics\n"
        "from lerobot_excav.envs.tasks.scoop.env import ExcavatorEnv\n"
        "print([name for name in ('lerobot', 'torch') if name in sys.modules])"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"
