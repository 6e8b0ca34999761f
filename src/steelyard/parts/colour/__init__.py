"""Which colours are one material: modes of colour, light and shade, fading, prints."""
