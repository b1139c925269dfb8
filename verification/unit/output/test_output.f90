!> A run of prescribed numbers through the whole output: what is due is written, a run that goes on
!! gives the files of one that was never stopped, older results are kept, errors are reported.
! ranks: 2 3
module test_output_m
  use kinds_m, only: wp
  use errors_m, only: exit_ok, exit_input, exit_files
  use parallel_m, only: is_root, broadcast
  use command_line_m, only: options_t
  use clock_m, only: clock_init
  use diagnostics_m, only: step_report_t, measure_fluid
  use output_m, only: output_t, open_output, write_due_output, close_output
  use restart_m, only: read_restart
  use hdf5_file_m, only: h5_file_t
  use sample_state_m, only: sample_t, make_sample, fill_cells
  use bed_m, only: bed_t
  use check_m, only: check
  implicit none
  private
  public :: test_output

  type(bed_t) :: no_bed
  character(*), parameter :: here = 'test-output'

contains

  subroutine test_output()
    call shell('rm -rf '//here//'*')
    call test_whole_and_parts()
    call test_folders()
    call shell('rm -rf '//here//'*')
  end subroutine test_output

  !> Run a shell command on the root process.
  subroutine shell(command)
    character(*), intent(in) :: command
    integer :: n

    if (is_root()) call execute_command_line(command)
    n = 0
    call broadcast(n)
  end subroutine shell

  !> The numbers of a state at its time, without any memory of how it was reached.
  subroutine move(s)
    type(sample_t), intent(inout) :: s
    integer :: b

    call fill_cells(s%clock%t, s%grid, 3, s%flow%u)
    call fill_cells(2*s%clock%t, s%grid, 1, s%flow%p)
    s%flow%liquid = 0.5_wp*s%grid%volume
    s%flow%fluid_volume = s%grid%volume
    s%solid%alpha = 0.25_wp
    s%flow%liquid_initial = 0.5_wp*s%grid%volume*product(s%grid%n)
    s%flow%liquid_inflow = 0.0_wp
    do b = 1, s%blocks%n
      s%blocks%x(:, b) = [0.04_wp*b, 0.03_wp, 0.1_wp - 0.01_wp*s%clock%t]
      s%blocks%q(:, b) = -s%blocks%q(:, b)   ! the sign means nothing and must not jump in the file
    end do
    if (s%clock%t > 1.5_wp .and. .not. s%blocks%present(3)) then
      s%blocks%present(3) = .true.
      s%blocks%release_time(3) = s%clock%t
    end if
  end subroutine move

  !> Steps of a quarter second up to `t_stop`, from the start or from a restart file.
  subroutine run(options, t_end, t_stop, exit_code)
    type(options_t), intent(in) :: options
    real(wp), intent(in) :: t_end, t_stop   !! of the case; where it is stopped [s]
    integer, intent(in) :: exit_code        !! given to the files
    type(sample_t) :: s
    type(output_t) :: output
    type(step_report_t) :: report
    integer :: info
    character(:), allocatable :: message

    call make_sample(0.0_wp, .false., s)
    s%case%run%t_end = t_end
    s%case%run%field_interval = 1.0_wp
    s%case%run%history_interval = 0.5_wp
    s%case%run%restart_interval = 0.75_wp
    call clock_init(s%case%run, s%clock)
    if (len(options%restart) > 0) then
      call read_restart(options%restart, s%parameters, s%run_state_t, info, &
                        message)
      call check('the restart file is read', info, 0)
    else
      call move(s)
    end if
    call open_output(s%case, s%parameters, options, s%run_state_t, no_bed, &
      output)
    call check('the output is opened', output%code, exit_ok)
    report%fluid = measure_fluid(s%case%fluid, s%grid, s%flow, s%solid)
    call write_due_output(s%run_state_t, report, output)
    do while (.not. s%clock%finished())
      call s%clock%choose_step(0.25_wp, huge(1.0_wp))
      call s%clock%advance()
      call move(s)
      report%substeps = s%clock%step
      report%fluid = measure_fluid(s%case%fluid, s%grid, s%flow, s%solid)
      if (s%clock%t >= t_stop) exit   ! as for a signal
      call write_due_output(s%run_state_t, report, output)
    end do
    call close_output(exit_code, s%run_state_t, report, &
      output)
    call check('the output is closed', output%code, exit_ok)
    if (output%code /= exit_ok) print '(a)', output%message
  end subroutine run

  subroutine test_whole_and_parts()
    type(options_t) :: options
    type(h5_file_t) :: whole
    real(wp) :: time(13), drift(13), release(3), energy(13), wanted
    integer :: i

    options%quiet = .true.
    options%restart = ''
    options%output = here//'/whole'
    call run(options, 5.75_wp, 9.0_wp, 0)
    options%output = here//'/parts'
    call run(options, 5.75_wp, 1.7_wp, 130)      ! stopped by a signal between two rows
    options%output = ''
    options%restart = here//'/parts/restart-a.h5'
    call run(options, 5.75_wp, 3.0_wp, 130)      ! at the time of a row and a frame
    options%restart = here//'/parts/restart-b.h5'
    options%output = here//'/copy'
    call run(options, 5.75_wp, 9.0_wp, 0)
    if (.not. is_root()) return

    call whole%open(here//'/whole/run.h5', .false., .false.)
    call whole%read('/series/time', time)
    call whole%read('/series/liquid_volume_drift', drift)
    call whole%read('/series/kinetic_energy_fluid', energy)
    call whole%read('/bodies/release_time', release)
    call whole%close()
    call check('rows are there', whole%info, 0)
    call check('rows come when due, and at the end', time, [(0.5_wp*i, i=0, 11), 5.75_wp], &
      1.0e-12_wp)
    call check('no drift', drift, [(0.0_wp, i=1, 13)], 0.0_wp)
    wanted = energy_at(2.0_wp)
    call check('the energy of the fluid is summed', energy(5), wanted, 1.0e-12_wp*wanted)
    call check('the true time of release is stored', release(3), 1.75_wp, 1.0e-12_wp)
    call compare_dataset('run.h5', '/bodies/quaternion', 13*3*4)
    call compare_dataset('run.h5', '/bodies/position', 13*3*3)
    call compare_dataset('run.h5', '/bodies/release_time', 3)
    call compare_dataset('run.h5', '/series/substeps', 13)
    call compare_dataset('fields.vtkhdf', '/VTKHDF/Steps/Values', 7)
    call compare_dataset('fields.vtkhdf', '/VTKHDF/CellData/velocity', 7*3*16*6*20)
    call compare_dataset('blocks.vtkhdf', '/VTKHDF/Steps/PointOffsets', 7)
    call check_attitudes()
    call check_restart()
  end subroutine test_whole_and_parts

  !> Sum of 1/2 m |u|^2 by a plain loop, with the halo-free part of `fill_cells`: half of each cell
  !! is water, a quarter air.
  function energy_at(t) result(energy)
    real(wp), intent(in) :: t
    real(wp), parameter :: mass = 1.0e-6_wp*(0.5_wp*998.2_wp + 0.25_wp*1.204_wp)   !! [kg]
    real(wp) :: energy, u
    integer :: i, j, k, d

    energy = 0.0_wp
    do d = 1, 3
      do k = 1, 20
        do j = 1, 6
          do i = 1, 16
            u = t + sin(1.0_wp*i + 100.0_wp*j + 10000.0_wp*k + 0.37_wp*d)
            energy = energy + 0.5_wp*mass*u**2
          end do
        end do
      end do
    end do
  end function energy_at

  !> The run in three parts has the same numbers as the run in one.
  subroutine compare_dataset(file_name, name, n)
    character(*), intent(in) :: file_name, name
    integer, intent(in) :: n
    type(h5_file_t) :: a, b
    real(wp) :: x(n), y(n)

    x = 1.0_wp
    y = 2.0_wp
    call a%open(here//'/whole/'//file_name, .false., .false.)
    call a%read(name, x)
    call a%close()
    call b%open(here//'/copy/'//file_name, .false., .false.)
    call b%read(name, y)
    call b%close()
    call check(name//' is the same in parts', x, y, 0.0_wp)
    if (b%info /= 0) print '(a)', b%message
  end subroutine compare_dataset

  !> w >= 0 at first and no jumps of sign.
  subroutine check_attitudes()
    type(h5_file_t) :: file
    real(wp) :: all_of_them(4*3*13), q(4, 3, 13)
    integer :: row

    all_of_them = 0.0_wp
    call file%open(here//'/copy/run.h5', .false., .false.)
    call file%read('/bodies/quaternion', all_of_them)
    call file%close()
    q = reshape(all_of_them, shape(q))
    call check('w >= 0 at the first row', all(q(1, :, 1) >= 0.0_wp))
    call check('quaternions do not jump', all([(sum(q(:, :, row)*q(:, :, row - 1)) > 2.9_wp, &
      row=2, 13)]))
  end subroutine check_attitudes

  !> The last restart file carries what an outsider needs to sum up the divergence.
  subroutine check_restart()
    type(h5_file_t) :: file
    real(wp), allocatable :: open_share(:)

    allocate (open_share(17*7*21*3))
    call file%open(here//'/whole/restart-b.h5', .false., .false.)
    call file%read('/flow/aperture', open_share)
    call file%close()
    call check('open shares are in the restart file', file%info, 0)
  end subroutine check_restart

  !> Older results are renamed, other folders are refused.
  subroutine test_folders()
    type(options_t) :: options
    type(sample_t) :: s
    type(output_t) :: output
    logical :: there

    options%quiet = .true.
    options%restart = ''
    options%output = here//'/whole/'
    call run(options, 0.5_wp, 9.0_wp, 0)
    call run(options, 0.5_wp, 9.0_wp, 0)
    inquire (file=here//'/whole.bak-2/run.h5', exist=there)
    call check('older results are kept', there)
    call shell('mkdir '//here//'/other && touch '//here//'/other/thesis.tex')
    options%output = here//'/other'
    call make_sample(0.0_wp, .false., s)
    call open_output(s%case, s%parameters, options, s%run_state_t, no_bed, &
      output)
    call check('a folder with other things is refused', output%code, exit_input)
    options%output = here//'/other/thesis.tex'
    call open_output(s%case, s%parameters, options, s%run_state_t, no_bed, &
      output)
    call check('a file is no folder', output%code, exit_input)
    options%output = here//'/other/thesis.tex/below'
    call open_output(s%case, s%parameters, options, s%run_state_t, no_bed, &
      output)
    call check('a folder that cannot be made is an error', output%code, exit_files)
    options%output = here//'/empty'
    call shell('mkdir '//here//'/empty')
    call run(options, 0.5_wp, 9.0_wp, 0)
    options%output = here//'/a/b/c'
    call run(options, 0.5_wp, 9.0_wp, 0)
    inquire (file=here//'/a/b/c/run.h5', exist=there)
    call check('folders are made as needed', there)
  end subroutine test_folders

end module test_output_m
