"""Atomic writing, locks, and checked reading of files."""
