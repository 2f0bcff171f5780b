"""Speed against error, and the audit of hard cases: what the choices cost on this machine."""
