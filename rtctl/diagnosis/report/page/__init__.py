"""The page of a diagnosis: summary, evidence, model, method."""
