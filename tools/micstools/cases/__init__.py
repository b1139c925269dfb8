"""Case files: settings, copies, the program that runs them, cases made by rule."""
