"""Servers, sessions and streams, with calls that wait and with calls that are awaited."""
