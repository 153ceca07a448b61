"""Make the table of one or more evaluations.

METRICS are metrics files (--env.metrics_path of lerobot-eval), or folders with a metrics.jsonl in them. LABEL=FILE
names a run; files given the same LABEL= are training seeds of one policy. With several runs, each is compared with
the first, scene by scene.

With --rows, a TOML file says what stands on a whole page: tables beside published figures, where every row comes from,
success against training, a video grid.

Examples:
  lerobot-excav report outputs/metrics.jsonl
  lerobot-excav report outputs/metrics.jsonl --operator=outputs/operator.jsonl --out=outputs/report
      also relate the retained mass to the operator's, from `lerobot-excav operator`; write report.md, report.json
  lerobot-excav report no_mask=a1.jsonl no_mask=a2.jsonl mask=b1.jsonl mask=b2.jsonl
      two policies, two training seeds each
  lerobot-excav report --rows=workflows/fr5_grasp/rows.toml --out=results/fr5_grasp
      the page of an experiment, from what has been run of it
  lerobot-excav report --rows=workflows/fr5_grasp/rows.toml --metrics_folder=outputs/trial/page/metrics
      the same of another run of it, printed only
"""

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from lerobot_excav.errors import require
from lerobot_excav.evaluation.metrics import read_evaluation
from lerobot_excav.evaluation.report import make_report, write_report
from lerobot_excav.evaluation.report_text import report_text
from lerobot_excav.evaluation.run import Run
from lerobot_excav.scripts.arguments import Arguments
from lerobot_excav.setting import setting


@dataclass(kw_only=True)
class ReportArguments(Arguments):
    """Arguments of `lerobot-excav report`."""

    POSITIONAL: ClassVar[str] = "metrics"

    metrics: list[str] = setting("[LABEL=]FILE or folder, any number", default_factory=list)
    rows: Path | None = setting("TOML file of a page, in place of METRICS", default=None)
    metrics_folder: Path | None = setting("With --rows: folder of the metrics in place of the file's", default=None)
    videos_folder: Path | None = setting("With --rows: folder of the videos in place of the file's", default=None)
    operator: Path | None = setting("Metrics file of an operator on the same scenes", default=None)
    out: Path | None = setting(
        "Folder for report.md, report.json and figures; replaces nothing but earlier reports", default=None
    )
    seed: int = setting("Seed of the bootstrap", default=0, low=0)


def run(arguments: ReportArguments) -> int:
    """Read, report, write; returns the exit code.

    Raises:
        ConfigurationError: Options exclude each other, or a value cannot be used.
        DatasetError: A metrics file cannot be used.
    """
    require(
        bool(arguments.metrics) != (arguments.rows is not None), "give either metrics files or --rows, and not both"
    )
    if arguments.rows is not None:
        return _page(arguments)
    for name in ("metrics_folder", "videos_folder"):
        folder = getattr(arguments, name)
        require(folder is None, f"--{name}={folder} is of use with --rows only")
    operator = None
    if arguments.operator is not None:
        operator = Run(label="operator", evaluations=(read_evaluation(arguments.operator),))
    report = make_report(runs_from(arguments.metrics), operator=operator, seed=arguments.seed)
    text = report_text(report)
    print(text)
    if arguments.out is not None:
        written = write_report(report, text, arguments.out)
        print(f"written: {', '.join(map(str, written))}")
    return 0


def _page(arguments: ReportArguments) -> int:
    """Make the page of an experiment."""
    from lerobot_excav.evaluation.result_page.contents import read_contents
    from lerobot_excav.evaluation.result_page.page import make_page
    from lerobot_excav.evaluation.result_page.page_files import write_page
    from lerobot_excav.evaluation.result_page.page_text import page_text

    require(arguments.operator is None, "--operator is of use with metrics files only; give it a row of the page")
    assert arguments.rows is not None
    page = make_page(
        read_contents(arguments.rows, metrics=arguments.metrics_folder, videos=arguments.videos_folder),
        seed=arguments.seed,
    )
    if arguments.out is None:
        print(page_text(page))
        return 0
    for path in write_page(page, arguments.out):
        print(f"written: {path}")
    return 0


def runs_from(results: list[str]) -> list[Run]:
    """Read runs in the order of their first mention, `[LABEL=]PATH` each.

    Without a label, it is the name of the file, or of its folder if that says more.

    Raises:
        ConfigurationError: One file was given twice, or two runs without a label would have the same name.
        DatasetError: A file cannot be used.
    """
    files: dict[str, list[Path]] = {}
    unlabeled = set()
    for result in results:
        label, path = _label_and_path(result)
        name = label or _default_label(path)
        require(
            name not in files or (bool(label) and name not in unlabeled),
            f"{path} and {files.get(name, [path])[0]} would both be called {name!r}; name them LABEL=FILE, with "
            "one label if they are training seeds of one policy",
        )
        if not label:
            unlabeled.add(name)
        files.setdefault(name, []).append(path)
    named = [path.resolve() for paths in files.values() for path in paths]
    require(len(set(named)) == len(named), "the metrics name a file twice; a file is one evaluation")
    return [
        Run(label=label, evaluations=tuple(read_evaluation(path) for path in paths)) for label, paths in files.items()
    ]


def _label_and_path(result: str) -> tuple[str, Path]:
    """Split `[LABEL=]PATH`; what exists as it stands is a path without a label."""
    label, separator, name = result.partition("=")
    return ("", Path(result)) if not separator or Path(result).exists() else (label, Path(name))


def _default_label(path: Path) -> str:
    return path.resolve().parent.name if path.stem == "metrics" else path.stem


ARGUMENTS = ReportArguments
