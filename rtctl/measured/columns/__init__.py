"""Columns of measured files: conversion to float64, units, the time axis."""
