"""The command line: options, printed text and exit codes."""
