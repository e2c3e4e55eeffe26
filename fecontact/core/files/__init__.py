"""Files written whole or not at all, files held by one process, files of others read safely."""
