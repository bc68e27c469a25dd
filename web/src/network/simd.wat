;; The arithmetic of a network in the page, with instructions that work on four or eight numbers at once (SIMD).
;; Nearly every processor has them, and JavaScript can't name them. affine.js and lstm.js say the same in plain
;; JavaScript, for browsers without, and tests hold this file against them. It exists because it is eight times
;; as fast. simd.js puts into the memory what is worked on and says where it lies; build.js (by wat.js) makes
;; bytes of this text.
;;
;; A `v128` is 16 bytes: eight i16, four i32 or four f32. Places in the memory are in bytes and end before `_end`.

(module
  (memory (import "network" "memory") 1)

  ;; y = scale * (weights · x) + bias, for one character.
  ;;
  ;; Weights are bytes, with a scale for each row. x is what `round` wrote: by turns two whole numbers, one of
  ;; which stands for `unit`, and what those two lack, in steps of `finer`. Weights lie as they are read: of sixteen
  ;; rows those of the first two columns (row 0: two, row 1: two, ...), of the next two columns, and so on; then
  ;; the next sixteen rows. So each of a register's four sums is a row's own. No sum leaves its 32 bits, because
  ;; `round` is told to keep x small enough.
  (func (export "affine")
    (param $weights i32) (param $scales i32) (param $bias i32)
    (param $x i32) (param $x_end i32) (param $y i32) (param $y_end i32) (param $unit f32) (param $finer f32)
    (local $at i32) (local $whole v128) (local $fine v128) (local $w v128)
    (local $a v128) (local $b v128) (local $c v128) (local $d v128) ;; sums of rows 0-3, 4-7, 8-11, 12-15
    (local $e v128) (local $f v128) (local $g v128) (local $h v128) ;; the same, of what is finer
    (loop $rows
      (local.set $a (v128.const i32x4 0 0 0 0))
      (local.set $b (v128.const i32x4 0 0 0 0))
      (local.set $c (v128.const i32x4 0 0 0 0))
      (local.set $d (v128.const i32x4 0 0 0 0))
      (local.set $e (v128.const i32x4 0 0 0 0))
      (local.set $f (v128.const i32x4 0 0 0 0))
      (local.set $g (v128.const i32x4 0 0 0 0))
      (local.set $h (v128.const i32x4 0 0 0 0))
      (local.set $at (local.get $x))
      (loop $columns
        (local.set $whole (v128.load32_splat (local.get $at))) ;; of two numbers of x, four times
        (local.set $fine (v128.load32_splat offset=4 (local.get $at)))
        (local.set $w (v128.load8x8_s (local.get $weights)))
        (local.set $a (i32x4.add (local.get $a) (i32x4.dot_i16x8_s (local.get $w) (local.get $whole))))
        (local.set $e (i32x4.add (local.get $e) (i32x4.dot_i16x8_s (local.get $w) (local.get $fine))))
        (local.set $w (v128.load8x8_s offset=8 (local.get $weights)))
        (local.set $b (i32x4.add (local.get $b) (i32x4.dot_i16x8_s (local.get $w) (local.get $whole))))
        (local.set $f (i32x4.add (local.get $f) (i32x4.dot_i16x8_s (local.get $w) (local.get $fine))))
        (local.set $w (v128.load8x8_s offset=16 (local.get $weights)))
        (local.set $c (i32x4.add (local.get $c) (i32x4.dot_i16x8_s (local.get $w) (local.get $whole))))
        (local.set $g (i32x4.add (local.get $g) (i32x4.dot_i16x8_s (local.get $w) (local.get $fine))))
        (local.set $w (v128.load8x8_s offset=24 (local.get $weights)))
        (local.set $d (i32x4.add (local.get $d) (i32x4.dot_i16x8_s (local.get $w) (local.get $whole))))
        (local.set $h (i32x4.add (local.get $h) (i32x4.dot_i16x8_s (local.get $w) (local.get $fine))))
        (local.set $weights (i32.add (local.get $weights) (i32.const 32)))
        (local.set $at (i32.add (local.get $at) (i32.const 8)))
        (br_if $columns (i32.lt_u (local.get $at) (local.get $x_end))))
      (v128.store (local.get $y) (call $scaled (local.get $a) (local.get $e)
        (local.get $unit) (local.get $finer) (v128.load (local.get $scales)) (v128.load (local.get $bias))))
      (v128.store offset=16 (local.get $y) (call $scaled (local.get $b) (local.get $f)
        (local.get $unit) (local.get $finer) (v128.load offset=16 (local.get $scales)) (v128.load offset=16 (local.get $bias))))
      (v128.store offset=32 (local.get $y) (call $scaled (local.get $c) (local.get $g)
        (local.get $unit) (local.get $finer) (v128.load offset=32 (local.get $scales)) (v128.load offset=32 (local.get $bias))))
      (v128.store offset=48 (local.get $y) (call $scaled (local.get $d) (local.get $h)
        (local.get $unit) (local.get $finer) (v128.load offset=48 (local.get $scales)) (v128.load offset=48 (local.get $bias))))
      (local.set $scales (i32.add (local.get $scales) (i32.const 64)))
      (local.set $bias (i32.add (local.get $bias) (i32.const 64)))
      (local.set $y (i32.add (local.get $y) (i32.const 64)))
      (br_if $rows (i32.lt_u (local.get $y) (local.get $y_end)))))

  ;; Write floats as whole numbers of 16 bits, none larger than `most`, as `affine` reads them. What one of
  ;; those stands for; NaN where a float is none, and so is then every y.
  (func (export "round")
    (param $values i32) (param $values_end i32) (param $x i32) (param $most f32) (result f32)
    (local $at i32) (local $largest v128) (local $one f32) (local $share v128) (local $exact v128) (local $whole v128)
    (local.set $at (local.get $values))
    (loop $look
      (local.set $largest (f32x4.max (local.get $largest) (f32x4.abs (v128.load (local.get $at)))))
      (local.set $at (i32.add (local.get $at) (i32.const 16)))
      (br_if $look (i32.lt_u (local.get $at) (local.get $values_end))))
    (local.set $one (f32.max
      (f32.max (f32x4.extract_lane 0 (local.get $largest)) (f32x4.extract_lane 1 (local.get $largest)))
      (f32.max (f32x4.extract_lane 2 (local.get $largest)) (f32x4.extract_lane 3 (local.get $largest)))))
    (local.set $share (f32x4.splat (f32.div (local.get $most) (local.get $one))))
    (loop $write
      (local.set $exact (f32x4.mul (v128.load (local.get $values)) (local.get $share)))
      (local.set $whole (f32x4.nearest (local.get $exact)))
      ;; four whole ones and what they lack, in steps of 1 / (2 most); then two and two of them by turns
      (local.set $whole (i16x8.narrow_i32x4_s
        (i32x4.trunc_sat_f32x4_s (local.get $whole))
        (i32x4.trunc_sat_f32x4_s (f32x4.nearest (f32x4.mul
          (f32x4.sub (local.get $exact) (local.get $whole))
          (f32x4.splat (f32.add (local.get $most) (local.get $most))))))))
      (v128.store (local.get $x)
        (i8x16.shuffle 0 1 2 3 8 9 10 11 4 5 6 7 12 13 14 15 (local.get $whole) (local.get $whole)))
      (local.set $x (i32.add (local.get $x) (i32.const 16)))
      (local.set $values (i32.add (local.get $values) (i32.const 16)))
      (br_if $write (i32.lt_u (local.get $values) (local.get $values_end))))
    (f32.div (local.get $one) (local.get $most)))

  ;; Four sums as floats: scale * (unit * sum + finer * fine) + bias
  (func $scaled (param $sum v128) (param $fine v128) (param $unit f32) (param $finer f32) (param $scale v128) (param $bias v128) (result v128)
    (f32x4.add (local.get $bias) (f32x4.mul (local.get $scale) (f32x4.add
      (f32x4.mul (f32x4.splat (local.get $unit)) (f32x4.convert_i32x4_s (local.get $sum)))
      (f32x4.mul (f32x4.splat (local.get $finer)) (f32x4.convert_i32x4_s (local.get $fine)))))))

  ;; What an LSTM remembers, four units at a time. `gates` holds input, forget, cell and output, `width` bytes each;
  ;; `cell` and `hidden` are written over.
  (func (export "remember")
    (param $gates i32) (param $width i32) (param $cell i32) (param $cell_end i32) (param $hidden i32)
    (local $forget i32) (local $new i32) (local $output i32) (local $kept v128)
    (local.set $forget (i32.add (local.get $gates) (local.get $width)))
    (local.set $new (i32.add (local.get $forget) (local.get $width)))
    (local.set $output (i32.add (local.get $new) (local.get $width)))
    (loop $units
      (local.set $kept (f32x4.add
        (f32x4.mul (call $sigmoid (v128.load (local.get $forget))) (v128.load (local.get $cell)))
        (f32x4.mul (call $sigmoid (v128.load (local.get $gates))) (call $tanh (v128.load (local.get $new))))))
      (v128.store (local.get $cell) (local.get $kept))
      (v128.store (local.get $hidden) (f32x4.mul (call $sigmoid (v128.load (local.get $output))) (call $tanh (local.get $kept))))
      (local.set $gates (i32.add (local.get $gates) (i32.const 16)))
      (local.set $forget (i32.add (local.get $forget) (i32.const 16)))
      (local.set $new (i32.add (local.get $new) (i32.const 16)))
      (local.set $output (i32.add (local.get $output) (i32.const 16)))
      (local.set $hidden (i32.add (local.get $hidden) (i32.const 16)))
      (local.set $cell (i32.add (local.get $cell) (i32.const 16)))
      (br_if $units (i32.lt_u (local.get $cell) (local.get $cell_end)))))

  ;; 2 sigmoid(2x) - 1
  (func $tanh (param $x v128) (result v128)
    (local.set $x (call $sigmoid (f32x4.add (local.get $x) (local.get $x))))
    (f32x4.sub (f32x4.add (local.get $x) (local.get $x)) (f32x4.splat (f32.const 1))))

  ;; 1 / (1 + exp(-x)); min, max and all that follows pass on what is no number
  (func $sigmoid (param $x v128) (result v128)
    (local $twos v128) (local $rest v128)
    ;; -x = ln 2 * twos + rest, with a whole number of twos
    (local.set $x (f32x4.neg (f32x4.max (f32x4.min (local.get $x) (f32x4.splat (f32.const 80))) (f32x4.splat (f32.const -80)))))
    (local.set $twos (f32x4.nearest (f32x4.mul (local.get $x) (f32x4.splat (f32.const 1.4426950409)))))
    (local.set $rest (f32x4.sub (local.get $x) (f32x4.mul (local.get $twos) (f32x4.splat (f32.const 0.6931471806)))))
    ;; exp(rest), as a series: 1 + rest + rest²/2 + rest³/6 + ... + rest⁶/720
    (local.set $x (f32x4.splat (f32.const 0.001388888889)))
    (local.set $x (f32x4.add (f32x4.mul (local.get $x) (local.get $rest)) (f32x4.splat (f32.const 0.008333333333))))
    (local.set $x (f32x4.add (f32x4.mul (local.get $x) (local.get $rest)) (f32x4.splat (f32.const 0.04166666667))))
    (local.set $x (f32x4.add (f32x4.mul (local.get $x) (local.get $rest)) (f32x4.splat (f32.const 0.1666666667))))
    (local.set $x (f32x4.add (f32x4.mul (local.get $x) (local.get $rest)) (f32x4.splat (f32.const 0.5))))
    (local.set $x (f32x4.add (f32x4.mul (local.get $x) (local.get $rest)) (f32x4.splat (f32.const 1))))
    (local.set $x (f32x4.add (f32x4.mul (local.get $x) (local.get $rest)) (f32x4.splat (f32.const 1))))
    ;; times 2^twos: added to the exponent, which begins at bit 23 of a float
    (local.set $x (i32x4.add (local.get $x) (i32x4.shl (i32x4.trunc_sat_f32x4_s (local.get $twos)) (i32.const 23))))
    (f32x4.div (f32x4.splat (f32.const 1)) (f32x4.add (f32x4.splat (f32.const 1)) (local.get $x)))))
