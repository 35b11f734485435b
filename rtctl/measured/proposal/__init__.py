"""From data files to a proposed manifest: what the files hold, what that probably is, and what must be asked.

survey (files -> columns) -> names and units -> roles and time -> records -> `Proposal` -> text of a manifest.
Only the survey reads files; the rest are pure functions.
"""
