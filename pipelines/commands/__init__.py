"""The commands of the program, one file each; nothing imports them but the command line."""
