"""Ccsds."""
