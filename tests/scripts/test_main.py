import subprocess
import sys

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


@pytest.mark.parametrize("command", COMMANDS)
def test_help_of_a_command_has_examples_that_name_it(command, capsys):
    with pytest.raises(SystemExit) as exit_info:
        main([command, "--help"])
    assert exit_info.value.code == 0
    text = capsys.readouterr().out
    assert "Examples:" in text
    assert f"lerobot-excav {command} " in text


def test_help_loads_nothing_heavy():
    code = (
        "import sys; from lerobot_excav.scripts.main import main\n"
        "try: main(['--help'])\n"
        "except SystemExit: pass\n"
        "sys.exit(bool({'torch', 'lerobot', 'mujoco', 'numba', 'numpy'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=False).returncode == 0


def test_an_unknown_command_is_refused(capsys):
    with pytest.raises(SystemExit) as exit_info:
        main(["dig"])
    assert exit_info.value.code == 2
    assert "invalid choice: 'dig'" in capsys.readouterr().err


def test_an_error_is_one_line_and_exit_code_2(capsys, tmp_path):
    assert main(["qc", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert error.startswith("lerobot-excav qc: ")
    assert error.count("\n") == 1


def test_ctrl_c_ends_with_130(monkeypatch, capsys):
    def interrupt(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(report, "run", interrupt)
    assert main(["report", "x"]) == 130
    assert "interrupted" in capsys.readouterr().err


def test_a_defect_of_the_program_keeps_its_traceback(monkeypatch):
    def fail(_):
        raise RuntimeError("a bug")

    monkeypatch.setattr(report, "run", fail)
    with pytest.raises(RuntimeError, match="a bug"):
        main(["report", "x"])


def test_errors_of_this_package_are_what_is_caught(monkeypatch, capsys):
    def fail(_):
        raise DatasetError("damaged")

    monkeypatch.setattr(report, "run", fail)
    assert main(["report", "x"]) == 2
    assert capsys.readouterr().err == "lerobot-excav report: damaged\n"


def test_an_error_of_the_system_names_the_file_in_one_line(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert main(["qc", str(tmp_path / "file")]) == 2
    assert (
        capsys.readouterr().err == f"lerobot-excav qc: {tmp_path / 'file/meta/info.json'}: Not a directory\n"
    )
