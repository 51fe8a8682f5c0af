"""Reports: what is to be said of a run, once, and how it looks as a web page and as PDF."""
