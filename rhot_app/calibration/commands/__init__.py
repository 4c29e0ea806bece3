"""The commands of the calibrations: arguments in, a report on standard output, a file only when it may be used."""
