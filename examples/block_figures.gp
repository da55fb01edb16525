# Draws docs/figures from the data of block_figures; script/figures calls it with `data` and `out` set.
set terminal svg size 640,380 dynamic font 'Helvetica,13' background '#ffffff'
set grid lc rgb '#dddddd'
set key above
set border 3 lc rgb '#666666'
set tics nomirror
blue = '#0072b2'; orange = '#d55e00'; green = '#009e73'; grey = '#888888'
file(name) = data.'/'.name.'.txt'
figure(name) = out.'/'.name.'.svg'

set output figure('dead_zone')
set xlabel 'reading u (degrees)'; set ylabel 'phi(u) (degrees)'
set arrow 1 from -10, graph 0 to -10, graph 1 nohead dt 2 lc rgb grey
set arrow 2 from 20, graph 0 to 20, graph 1 nohead dt 2 lc rgb grey
set label 1 'lower' at -10, graph 0.06 right offset -1,0 tc rgb grey
set label 2 'upper' at 20, graph 0.06 left offset 1,0 tc rgb grey
plot file('dead_zone') using 1:2 with lines lw 2.5 lc rgb blue title 'dead zone of the article''s thumb', x with lines dt 3 lc rgb grey title 'u'
unset arrow; unset label

set output figure('curve')
set xlabel 'reading u'; set ylabel 'f(u) (degrees)'
plot file('curve') index 0 using 1:2 with lines lw 2.5 lc rgb blue title 'f', \
     file('curve') index 1 using 1:2 with points pt 7 ps 0.9 lc rgb orange title 'knots (x_k, y_k)' noenhanced

set output figure('hysteresis')
set xlabel 'reading u (degrees)'; set ylabel 'z (degrees)'
plot file('hysteresis') using 2:3 with lines lw 1.8 lc rgb blue title 'two plays, radii 4 and 12, weights 0.5', x with lines dt 3 lc rgb grey title 'u'

set output figure('lags')
set xlabel 't (s)'; set ylabel 'y (degrees)'
set yrange [0:175]
plot file('lags') index 0 using 1:2 with lines lw 2 lc rgb grey title 'continuous, pole -19 rad/s', \
     file('lags') index 1 using 1:2 with points pt 7 ps 0.9 lc rgb blue title 'exact hold at 10 Hz', \
     file('lags') index 1 using 1:3 with steps dt 2 lw 1.5 lc rgb green title 'the same, read before its update', \
     file('lags') index 1 using 1:4 with linespoints pt 4 lw 1.5 lc rgb orange title 'Euler''s rule'
set yrange [*:*]

set output figure('saturation')
set xlabel 'reading alpha (degrees)'; set ylabel 'beta at rest (degrees)'
plot file('saturation') using 1:2 with lines lw 2.5 lc rgb orange title 'Wiener: gain, lags, saturation', \
     file('saturation') using 1:3 with lines lw 2.5 lc rgb blue title 'Hammerstein-Wiener: dead zone, gain, lag, saturation', \
     x with lines dt 3 lc rgb grey title 'Raw'

set output figure('lead')
set xlabel 't (s)'; set ylabel 'angle (degrees)'
plot file('lead') index 0 using 1:2 with lines lw 5 lc rgb '#cccccc' title 'finger', \
     file('lead') index 0 using 1:3 with lines lw 2 lc rgb orange title 'c_0 = 0: late by 1/19 s' noenhanced, \
     file('lead') index 1 using 1:3 with lines lw 2 lc rgb grey title 'c_0 = 1: as it comes' noenhanced, \
     file('lead') index 2 using 1:3 with lines lw 2 lc rgb blue title 'c_0 = 2: early by 1/19 s' noenhanced

set output figure('alignment')
set xlabel 'clock offset tried (s)'; set ylabel 'eta squared'
set yrange [0:1.05]; set xrange [-8:12]
plot file('alignment') index 0 using 1:2 with lines lw 1.8 lc rgb blue title 'share of the angle that the reading explains', \
     file('alignment') index 1 using 1:2 with lines dt 2 lw 1.5 lc rgb orange title 'true offset'
set yrange [*:*]; set xrange [*:*]

set output figure('resampler')
set xlabel 't (s)'; set ylabel 'reading'
plot file('resampler') index 0 using 1:2 with points pt 6 ps 0.7 lc rgb grey title 'rows of the log, in bursts', \
     file('resampler') index 1 using 1:2 with points pt 7 ps 0.8 lc rgb blue title 'grid of 10 Hz', \
     file('resampler') index 2 using 1:2 with points pt 2 ps 0.9 lc rgb orange title 'held through a pause'

set output figure('trial')
set xlabel 't (s)'; set ylabel 'thumb (degrees)'
set xrange [0:10]; set yrange [85:175]
plot file('trial') index 0 using 1:2 with lines lw 5 lc rgb '#cccccc' title 'finger, rho_r' noenhanced, \
     file('trial') index 1 using 1:2 with steps dt 3 lc rgb grey title 'reading, alpha', \
     file('trial') index 0 using 1:3 with lines lw 2 lc rgb orange title 'hand behind Wiener, rho', \
     file('trial') index 2 using 1:3 with lines lw 2 lc rgb blue title 'hand behind Hammerstein-Wiener, rho'
