"""Schema 2 of corpora: whole scenes with several people; arrays, body layers and laws."""
