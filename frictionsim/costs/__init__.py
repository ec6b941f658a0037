"""Work-precision studies: one scenario solved by every backend with several settings."""
