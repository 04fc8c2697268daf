"""Report of a study, from its records only: ``report.html`` and ``report.md``."""

from compare.report.study_report import FurtherFiles, renew_report, write_report

__all__ = ["FurtherFiles", "renew_report", "write_report"]
