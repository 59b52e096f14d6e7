"""What is wrong with this log, before anybody believes a fit of it? ::

diagnosis = examine(read("run.csv"), *read_known("furuta"))
for finding in diagnosis.findings:
    print(finding.severity, finding.sentence, finding.key)
"""

from __future__ import annotations

from upright.diagnosis.case import read_known
from upright.diagnosis.examine import examine
from upright.diagnosis.findings import KINDS, Curve, Diagnosis, Finding, Panel

__all__ = ["KINDS", "Curve", "Diagnosis", "Finding", "Panel", "examine", "read_known"]
