"""The digital twin: a posed hand becomes images, images enter real node daemons, truth goes to a file."""
