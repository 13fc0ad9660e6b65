"""The printed model in parts: marks, joints, balls with sockets, and plates of parts for a printer's bed."""
