"""Whether tools/headers tells headers that need something before them.

    headers_test.py SOURCE_FOLDER
"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(sys.argv.pop(1))


class Headers(unittest.TestCase):
    def said(self, **headers):
        """Exit status and words over kernels/NAME.h with these texts."""
        with tempfile.TemporaryDirectory() as folder:
            kernels = pathlib.Path(folder) / 'kernels'
            kernels.mkdir()
            for name, text in headers.items():
                (kernels / f'{name}.h').write_text('#pragma once\n' + text, encoding='utf-8')
            run = subprocess.run([SOURCE / 'tools/headers', '--folder', folder], check=False, capture_output=True, text=True)
            return run.returncode, run.stdout + run.stderr

    def test_passes_what_includes_what_it_names(self):
        self.assertEqual((0, ''), self.said(a='#include <vector>\nstd::vector<int> f();\n',
                                            b='#include "kernels/a.h"\ninline auto g() { return f(); }  // std::map is not used\n'))

    def test_tells_a_standard_header_that_others_bring(self):
        # <map> brings no promise of <vector>, whatever it includes here.
        status, words = self.said(a='#include <map>\nstd::map<int, std::vector<int>> f();\n', b='#include <vector>\n')
        self.assertEqual(1, status)
        self.assertIn('kernels/a.h: std::vector is used, but none of these is included: <vector>', words)

    def test_tells_a_header_of_the_project_that_is_not_included(self):
        status, words = self.said(a='struct Shape {};\ninline constexpr int kSides = 3;\n',
                                  b='Shape make(int sides = kSides);\n', c='struct Shape;\nShape* find();\n')
        self.assertEqual(1, status)
        self.assertIn('kernels/b.h: Shape is used, but none of these is included: kernels/a.h', words)
        self.assertIn('kernels/b.h: kSides is used, but none of these is included: kernels/a.h', words)
        self.assertIn('kernels/b.h does not compile alone', words)
        self.assertNotIn('kernels/c.h', words)

    def test_asks_the_compiler_where_the_text_leaves_a_doubt(self):
        given = {'a': 'inline int twice(int x) { return 2 * x; }\nstruct Shape {};\n'}
        status, words = self.said(**given, b='inline int four() { return twice(2); }\n')
        self.assertEqual(1, status)
        self.assertIn('kernels/b.h does not compile alone', words)
        status, words = self.said(**given, c='struct Shape;\nstruct Plan {\n    Shape shape;\n};\n')
        self.assertEqual(1, status)
        self.assertIn('kernels/c.h does not compile alone', words)

    def test_tells_a_name_that_it_does_not_know(self):
        status, words = self.said(a='#include <vector>\nusing std::cyl_bessel_j;\n')
        self.assertEqual(1, status)
        self.assertIn('std::cyl_bessel_j is not known to tools/headers', words)


unittest.main()
