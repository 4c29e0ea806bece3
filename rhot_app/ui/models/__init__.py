"""What the screens say, without Qt: sliding windows, words, colours, rows. Every class here is tested without a window."""
