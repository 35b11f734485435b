"""Contacts: free play, and stops at one place or two."""
