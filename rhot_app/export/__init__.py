"""What users take away: recordings tracked and written as files that other programs read, one by one or in batches."""
