"""The soil against published experiments: one file per experiment, gates as published, a report of what was measured.

    experiment   what an experiment is, and what it found
    results      gates, tables and plots of a result
    catalogue    all experiments
    report       Markdown
    plots        pictures of the report

The experiments use the soil's public surface only.
"""
