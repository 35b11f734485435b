"""The diagnosis problem: records, plant subject, hypotheses and their fit, the work budget."""
