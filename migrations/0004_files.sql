-- Which jobs a sample file holds: asked when files are merged, checked or replaced.
CREATE INDEX sample_index_by_file ON sample_index (file, first_row);
