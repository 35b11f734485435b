"""The Preisach model: Everett function, regressors, corners."""
