"""What every result shares on its way out: records as text, whole files, figures."""
