import subprocess
import sys
from importlib.metadata import version

import pytest

from lerobot_excav.errors import DatasetError
from lerobot_excav.scripts import report
from lerobot_excav.scripts.main import COMMANDS, main


def test_help_of_the_whole_lists_every_command(capsys):
    with pytest.raises(SystemExit) as exit_info:
        main(["--help"])
    assert exit_info.value.code == 0
    text = capsys.readouterr().out
    assert all(f"\n  {name} " in text for name in COMMANDS)


def test_the_version_is_told(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"lerobot-excav {version('lerobot_env_excav')}\n"


def test_help_loads_nothing_heavy():
    code = (
        "import sys; from lerobot_excav.scripts.main import main\n"
        "try: main(['--help'])\n"
        "except SystemExit: pass\n"
        "sys.exit(bool({'torch', 'lerobot', 'mujoco', 'numba', 'pandas'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=False).returncode == 0


def test_an_unknown_command_is_refused(capsys):
    with pytest.raises(SystemExit) as exit_info:
        main(["dig"])
    assert exit_info.value.code == 2
    assert "invalid choice: 'dig'" in capsys.readouterr().err


def test_an_error_is_one_line_and_exit_code_2(capsys, tmp_path):
    (tmp_path / "file").write_text("")
    for folder, problem in (
        (tmp_path, f"{tmp_path} is not a LeRobot dataset: it has no meta/info.json"),
        (tmp_path / "file", f"{tmp_path / 'file/meta/info.json'}: Not a directory"),
    ):
        assert main(["qc", str(folder)]) == 2
        assert capsys.readouterr().err == f"lerobot-excav qc: {problem}\n"
    for command, missing in (("qc", "dataset"), ("demos", "--out"), ("operator", "--metrics")):
        assert main([command]) == 2
        assert f"{missing} is missing" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "code", "text"), [(KeyboardInterrupt(), 130, "interrupted"), (DatasetError("damaged"), 2, "damaged")]
)
def test_ctrl_c_and_errors_of_this_package_have_their_own_codes(monkeypatch, capsys, error, code, text):
    def fail(_):
        raise error

    monkeypatch.setattr(report, "run", fail)
    assert main(["report", "x"]) == code
    assert capsys.readouterr().err.strip() == f"lerobot-excav report: {text}"


def test_a_defect_of_the_program_keeps_its_traceback(monkeypatch):
    def fail(_):
        raise RuntimeError("a bug")

    monkeypatch.setattr(report, "run", fail)
    with pytest.raises(RuntimeError, match="a bug"):
        main(["report", "x"])
