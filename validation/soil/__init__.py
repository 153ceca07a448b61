"""The soil against published experiments: one file per experiment, gates as published, a report of what was measured.

    experiment   what an experiment is, and the conditions under which it runs
    results      gates and tables of a result
    catalogue    all experiments
    report       Markdown, from a template
    plots        pictures of the report
    reference    slow twins of the compiled kernels, for tests

The experiments use the soil's public surface only. Run them with `python -m validation.soil`.
"""
