"""What a team may have read wrongly: units, signs, order and owner of its numbers, put right or named."""
