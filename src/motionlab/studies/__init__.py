"""Would people believe it? A study in which people judge motions, from clips to tables.

`study` holds what a study is, `build` makes one of motions, `page` the page on which people answer,
`answers` reads what they saved, `ratings` and `pairs` are the statistics, `analysis` puts all of it
together, and `simulate` answers in people's stead, to try an analysis before anybody is asked.
"""
