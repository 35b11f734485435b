"""Parts of records that a search sees: whole ones where initial parts hide what is wrong, longer ones behind causes."""
