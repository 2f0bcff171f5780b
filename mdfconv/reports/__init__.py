"""What the project reproduces and shows: tables and figures as data, files and text."""
