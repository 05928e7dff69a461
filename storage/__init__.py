"""What synth, forests and pipelines share, below all of them: atomic writing, digested files, and lazy exports."""
