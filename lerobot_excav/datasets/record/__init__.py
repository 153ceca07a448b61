"""Recording demonstrations with the scripted operator."""
