"""The log as given beside the ways in which it is commonly misread; each is put right where there is no doubt."""
