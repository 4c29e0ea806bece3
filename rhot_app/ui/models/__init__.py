"""What the screens say, without Qt: windows, words, colours, rows. Every class here is tested without a window."""
