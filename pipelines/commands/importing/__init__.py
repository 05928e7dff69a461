"""The subcommands of `undergrowth import`."""
