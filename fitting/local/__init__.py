"""Attitude from single samples."""
