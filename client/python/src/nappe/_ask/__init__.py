"""What a caller gives, checked and put into messages: changes, meshes, the frame to begin at, what to ask next."""
