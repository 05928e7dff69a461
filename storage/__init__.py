"""What synth, forests and pipelines share, below all: atomic writing, digested files, ranges, lazy exports."""
