"""Files for other programs, one writer each; tables stand above, for data frames are made of them, too."""
