"""The report: one page out of an ablation's folder, tables, charts and pictures in one file; docs/report.md."""
