"""Many cases of one study: which ones, run by any executor, kept in a folder, as one table."""
