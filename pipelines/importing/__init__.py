"""undergrowth import: real recordings, models and depth for the generator; a module a kind.

Each kind is a command of two words in `pipelines.cli.COMMANDS`, such as "import mocap".
"""
